"""The statements of a certificate: its content, where that comes from, the sentences made of it, and why one does not
hold."""
