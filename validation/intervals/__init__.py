"""Coverage of the stated intervals: units simulated apart from the program, each quantity against its own truth.

python -m validation.intervals [--repeats 200] [--section stroke]
"""
