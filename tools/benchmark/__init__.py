"""How fast a control step is: this suite against plain MuJoCo and an ordinary environment."""
