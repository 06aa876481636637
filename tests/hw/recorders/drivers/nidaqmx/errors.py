class Error(Exception):
    pass


class DaqError(Error):
    pass
