"""The analogue world between the generator's terminal and the converter's inputs."""
