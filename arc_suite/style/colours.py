"""Colours of pictures, Okabe and Ito's and Tol's, told apart by colour-blind eyes too."""

BLUE, VERMILION = "#0072B2", "#D55E00"
INK, FAINT, PALE = "#333333", "#8C8C8C", "#E3E3E3"
TERM_COLOURS = {
    "forward": BLUE,
    "healthy": "#56B4E9",
    "gait_bonus": "#009E73",
    "gait_cost": VERMILION,
    "control": "#E69F00",
    "smoothness": "#F0E442",
    "contact": "#CC79A7",
    "angular_velocity": "#882255",
    "vertical_velocity": "#332288",
    "posture": "#999933",
}
