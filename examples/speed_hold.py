"""A PID holds a train's speed through a transport delay; prints the outcome, saves a figure."""

from railcosim import Delay, Diagram, Fmu, Step
from railcosim.controllers import PID
from railcosim.fmus import build
from railcosim.models import second_order_train


def speed_hold() -> Diagram:
    """Return the loop: target, controller, delayed command, train."""
    loop = Diagram("speed_hold", step=0.05)
    loop.add("target", Step(at=1.0, to=10.0, unit="m/s"))
    loop.add("pid", PID(kp=6.65, ti=2.83, td=0.707, limits=(-10, 10)))
    loop.add("link", Delay(0.4))
    loop.add("train", Fmu(build(second_order_train()), gain=2.2))
    loop.connect("target.y", "pid.reference")
    loop.connect("train.speed", "pid.measurement")
    loop.connect("pid.u", "link.u")
    loop.connect("link.y", "train.u")
    return loop


if __name__ == "__main__":
    run = speed_hold().run(stop=60.0)
    print(run.frame[["target.y", "train.speed", "link.y"]].iloc[::200])
    run.scope("target.y", "train.speed", "link.y").savefig("speed_hold.png")
