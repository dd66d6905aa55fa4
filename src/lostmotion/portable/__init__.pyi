from .descriptions import description as description
