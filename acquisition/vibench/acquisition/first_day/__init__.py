"""The first day at a bench: questions, the resulting configuration, and a page with the record.

`configured` asks `QUESTIONS` and writes a commented hardware configuration; `first_day` uses it to confirm
wires, measure the noise floor, play a first 5 mV and check the bench; it returns the page. The caller asks
the questions: a terminal, a file of answers, a test. `vibench bench new` does all of it (docs/first-day.md).
"""
