"""Random cases of all kinds of input, each under a watchdog: `make fuzz`.

A kind is a module with a function ``case(random, folder)``. It makes its input in the empty working directory `folder`, and raises
`verdict.Failure`, or whatever the package raises, where the product fails.
"""
