from .selection.task_file import load_task as load_task
from .study.study_definition import Study as Study
from .study.study_files import load_study as load_study
