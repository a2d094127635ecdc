"""The first day at a bench: questions, the configuration that they make, and a page that is the record.

`configured` asks `QUESTIONS` and writes a commented hardware configuration; `first_day` goes through wires,
noise floor, a first 5 mV and the bench check with it, and gives the page that is the record. Who asks is the
caller's: a terminal, a file of answers, a test. `vibench bench new` does all of it (docs/first-day.md).
"""
