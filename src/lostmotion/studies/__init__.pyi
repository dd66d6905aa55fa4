from .file import load_study as load_study
from .study import Study as Study
from .task_file import load_task as load_task
