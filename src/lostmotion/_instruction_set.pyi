def supports_avx2() -> bool:
    """Whether processor and system can run the build of the core for AVX2."""
