"""Duration of a cycle of the control loop: the paper's Table I with the figures of this machine.

A cycle is one decision of the executor, with the request's event and the silent steps after it. *Without middleware*
the generated controller publishes into nothing, while its sensors change. *With middleware* it drives, and publishes
a Twist that a subscriber in another process takes, with a pause between cycles: what is measured is not how fast a
queue fills.
"""
