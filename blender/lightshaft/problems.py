"""What of a scene cannot be exported, in Blender's words, with the name of the object, the node and what to do."""


class ExportError(Exception):
    """The scene is not rendered; the message lists why."""


class Problems:
    """Collects what is wrong, so that a user sees all of it at once.

    `leave_out`: what Lightshaft does not have is left out and reported, instead of refused.
    """

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
