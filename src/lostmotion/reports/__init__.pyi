from .accessor import ResultAccessor as ResultAccessor
