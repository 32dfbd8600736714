"""The four creatures of the paper, as data: domain name -> `Body`."""

from arc_suite.robots import bastion, leaper, queen, tick

ROBOTS = {module.BODY.name: module.BODY for module in (queen, bastion, tick, leaper)}
