"""Results as figures, tables, pages and text."""
