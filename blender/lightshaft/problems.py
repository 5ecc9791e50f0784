"""Collects what cannot be exported from a scene, in Blender's terms: object, node and what to do."""


class ExportError(Exception):
    """The scene is not rendered. The message lists the reasons."""


class Problems:
    """Collects problems, so that a user sees all of them at once. With `leave_out`, features that Lightshaft does
    not have are left out and reported instead of refused."""

    def __init__(self, leave_out=False):
        self.leave_out, self.errors, self.warnings = leave_out, [], []

    def error(self, message):
        if message not in self.errors:
            self.errors.append(message)

    def warning(self, message):
        if message not in self.warnings:
            self.warnings.append(message)

    def unsupported(self, message):
        if self.leave_out:
            self.warning(f"{message} (left out)")
        else:
            self.error(message)

    def raise_errors(self):
        if self.errors:
            raise ExportError("\n".join(self.errors))
