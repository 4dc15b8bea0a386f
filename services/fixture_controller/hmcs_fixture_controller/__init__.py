"""The fixture controller: turns the operator's velocity into the robot's reference velocity."""
