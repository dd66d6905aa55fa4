"""The live page: a drive in the browser, solved there by the same core."""
