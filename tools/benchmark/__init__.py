"""How fast a control step is: this suite beside plain MuJoCo and beside what one would write without it."""
