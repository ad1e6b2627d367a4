"""What the tests of clients share."""

ENV = "fish_env:RoboticFish3D-v0"
