"""A wagon written with CasADi's DaeBuilder hits a buffer; exports its FMU, runs it, saves a figure.

`wagon.fmu` runs in any tool that knows FMI 2.0.
"""

import casadi as ca

from railcosim import Diagram, Fmu, Pulse
from railcosim.fmus import export


def wagon() -> ca.DaeBuilder:
    """Return m v' = F - c v, with a buffer at 30 m that sends the wagon back at half its speed."""
    dae = ca.DaeBuilder("wagon")
    force = dae.add("force", "input", {"unit": "N", "description": "locomotive's push"})
    mass = dae.add("mass", "parameter", "fixed", {"start": 20e3, "unit": "kg", "min": 1e3})
    drag = dae.add("drag", "parameter", "tunable", {"start": 400.0, "unit": "N.s/m"})
    position = dae.add("position", "output", {"unit": "m"})
    speed = dae.add("speed", "output", {"unit": "m/s"})
    resistance = dae.add("resistance", "output", {"unit": "N"})
    hits = dae.add("hits", "output", {"type": "Int32", "start": 0})
    dae.eq(resistance, drag * speed)
    dae.eq(dae.der(position), speed)
    dae.eq(dae.der(speed), (force - resistance) / mass)
    dae.when(position > 30, [dae.reinit("speed", -0.5 * speed), dae.assign("hits", hits + 1)])
    dae.set_stop_time(40.0)
    return dae


def shunting() -> Diagram:
    """Return the wagon, pushed for five seconds."""
    yard = Diagram("shunting", step=0.05)
    yard.add("push", Pulse(at=1.0, width=5.0, height=8e3, unit="N"))
    yard.add("wagon", Fmu(export(wagon(), "wagon.fmu")))
    yard.connect("push.y", "wagon.force")
    return yard


if __name__ == "__main__":
    run = shunting().run(stop=40.0)
    print(run.frame[["wagon.position", "wagon.speed", "wagon.hits"]].iloc[::100])
    run.scope("wagon.position", "wagon.speed").savefig("dae_builder.png")
