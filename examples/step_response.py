"""How far does the load go for a small step of the command, in the three models of the gearbox?"""

import lostmotion as lm
from lostmotion.paper import MODELS, paper_scenario

step = lm.CommandSignal(steps=[{"height": 0.03, "time": 0.1}, {"height": -0.03, "time": 0.6}])
for model in MODELS:
    result = lm.simulate(paper_scenario(model, "small"), command=step, duration=1.5)
    angle = float(result["load_angle"][-1])
    stuck = float((result["input_contact"] == 0).mean())
    print(f"{model:9} load angle {1e3 * angle:7.3f} mrad, input shaft stuck {100 * stuck:3.0f} % of the time")
