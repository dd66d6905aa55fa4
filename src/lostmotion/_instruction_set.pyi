def builds() -> list[str]:
    """Names of the builds of the core that processor and system can run, the widest vectors first."""
