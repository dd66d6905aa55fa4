from .scenario_as_numbers import description as description
