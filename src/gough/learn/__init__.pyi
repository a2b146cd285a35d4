from .gradients import TorchSolution as TorchSolution
from .gradients import leg_lengths as leg_lengths
from .gradients import solve as solve
