"""The program, called in the test's own process."""

from typer.testing import CliRunner, Result

from accept.cli.main import app


def accept(*words: object, code: int | None = None, columns: int | None = None) -> Result:
    """Run a command, which must not fall over, and must end with a code if one is given. columns: of its terminal."""
    done = CliRunner().invoke(app, [str(w) for w in words], env={"COLUMNS": str(columns)} if columns else None)
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exc_info
    assert code is None or done.exit_code == code, done.output
    return done
