"""Attacks on the commands that control a vehicle: signals, standstills, wrong messages, full disks.

`plan` samples what happens in a run, a `peer` is the vehicle's side of a link, `command_process` the process,
`link_run` a run with its verdict, `links_soak` many of them.
"""
