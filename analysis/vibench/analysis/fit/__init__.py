"""The specimen that is really on the shaker, fitted to the recordings of one campaign.

Damping and frequencies come from the weakest noise, the gap of each side from tracking a motion that
collides. A model that the recordings contradict is refused, and the assumptions that would mend it are
ranked. Every value has its bounds; what could not be told is said.
"""
