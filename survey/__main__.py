"""`python -m survey` is the program `survey`."""

from survey.cli import main

main()
