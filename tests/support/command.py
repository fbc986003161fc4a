"""The whole command, run in this process as a person would type it."""

from typer.testing import CliRunner

from mambo_nmpc.sil.cli.app import app


def run(*arguments: str, code: int = 0) -> tuple[str, str]:
    """Run mambo-nmpc, demand its exit code, and return stdout and stderr."""
    result = CliRunner().invoke(app(), arguments)
    assert result.exit_code == code, (result.output, result.exception)
    return result.stdout, result.stderr
