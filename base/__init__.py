"""The platform: behaviours that vote, and the arbiter that fuses them.

======================  ===========================================================================
who decides             ``platform`` (a step), ``tasks`` (which behaviour does a task), ``arbiter``,
                        ``fusion`` (one wish of many votes), ``jerk`` (the way to it), ``progress``
                        (does it get anywhere), ``notice`` (warns before moving), ``arm_goal``
what a behaviour is     ``behaviour``: ``Vote``, ``Senses``, the protocol
behaviours, the task's  ``hold_still``, ``drive_to`` (``turn_drive_turn`` on a differential drive),
                        ``find_way``, ``position``, ``dock``, ``follow_path``, ``keep_in_reach``,
                        ``program``
behaviours, always      ``avoid``, ``give_way``, ``respond_to_contact``
what the laser shows    ``picture``, made of ``view`` (one scan), ``movers``, ``remembered``
                        (standing points), ``seen`` (floor known to be free); ``line`` (a surface)
ways and motions        ``way_map`` and ``polyline`` (among obstacles), ``paths`` (in time),
                        ``approach`` (speed towards a goal), ``settle`` (the last millimetres),
                        ``stand`` (rest, then hold), ``planar`` (poses and twists)
programs                ``nodes/`` (node types), ``programs/``
======================  ===========================================================================

Poses are X_OB, velocities V_OB_B unless a name says otherwise: docs/notation.md.
"""
