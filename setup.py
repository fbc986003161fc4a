"""Build in a folder of its own: setuptools would ship whatever an earlier build left in build/lib."""

from tempfile import TemporaryDirectory

from setuptools import setup

with TemporaryDirectory() as folder:
    setup(options={"build": {"build_base": folder}})
