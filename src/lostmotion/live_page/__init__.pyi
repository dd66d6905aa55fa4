from .notebook import LivePage as LivePage
