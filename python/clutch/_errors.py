"""Errors of the package's own."""


class ParamError(ValueError):
    """A parameter is out of range, of the wrong type, unknown or missing.

    Parameters
    ----------
    message : str
        The fault, its place, and the expectation.
    field : str, default ""
        The parameter: within an object its name, as ``kp_v``; within a scenario its dotted key, as
        ``law.smc.kp_v``. Empty if it is about the whole.
    value : object, default None
        The value that was refused, in the parameter's unit.

    Examples
    --------
    >>> import clutch
    >>> try:
    ...     clutch.Smc(kp_v=-1)
    ... except clutch.ParamError as error:
    ...     print(error.field, error.value)
    kp_v -1
    """

    field: str
    value: object

    def __init__(self, message: str, field: str = "", value: object = None) -> None:
        super().__init__(message)
        self.field = field
        self.value = value


class DoesNotApply(ValueError):
    """An engine does not take a case of the referee: no fault of either.

    Examples
    --------
    >>> from clutch import referee
    >>> try:
    ...     referee.cases()["P3"].run("bristle")
    ... except referee.DoesNotApply as error:
    ...     print(error)
    it needs friction with bristles in every row
    """


class LoopError(RuntimeError):
    """The loop was refused, or could not be started: gains that are not certified, a port, a board.

    Its text is the one of ``clutch loop``, and says what to do. Nothing has moved.

    Examples
    --------
    >>> import clutch
    >>> try:
    ...     clutch.loop(port="/dev/ttyNOTHERE7")
    ... except clutch.LoopError as error:
    ...     print(str(error).split(";")[0])
    /dev/ttyNOTHERE7: there is no such device
    """
