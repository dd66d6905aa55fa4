"""Logs as the fit takes them: in SI units, screened, split at pauses of the recorder."""
