"""The independent plant: apparatus and patient as a MuJoCo model. MuJoCo is imported only when such a plant is made."""
