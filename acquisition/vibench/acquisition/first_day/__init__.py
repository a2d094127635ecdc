"""First day at a bench: questions, the resulting configuration, and a page with the test results.

`configured` asks `QUESTIONS` and writes a commented hardware configuration; `first_day` uses it to confirm
wires, measure the noise floor, play a first 5 mVpp sine and check the bench; it returns the page. The caller
supplies the answers (terminal, file or test). `vibench bench new` does all of this (docs/first-day.md).
"""
