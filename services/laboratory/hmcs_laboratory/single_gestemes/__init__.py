"""Classification of single gestemes by models in closed loop, as the drawings study compares."""
