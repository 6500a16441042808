"""Thorax surface and contact points of the authors' scaled model of par2.

Of scaled_par2.xml (zoufaond/Quaternion-Predictive-SHR, 98b9480), as das3_readosim.m reads it [m]:
the ellipsoid is wrap object thoracic_wall, the points are the skin markers TS and AI, 25 mm behind
those of DAS3. On this surface the lower angle of the published scapulae glides within 1 mm; the
recorded scapulae are deep inside.
"""

THORAX_CENTRE_M = (0.0, -0.1347, 0.0550)
THORAX_RADII_M = (0.1380, 0.2074, 0.1046)
CONTACT_POINTS_M = {
    "contact_TS": (-0.1036, -0.0134, 0.0281),
    "contact_AI": (-0.1063, -0.1254, 0.0277),
}
