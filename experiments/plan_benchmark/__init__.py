"""Measures the planners of a point (`points`) and of the whole arm on published problems: options in `config`, problems in
`problems`, the exact collision check in `checker`, the stages of guesses in `solve`, times in `speed`, the arm's rows in `arm`
and `rows`, the file of rows in `results`, the machine in `about`."""
