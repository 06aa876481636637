"""Where the APA sits between its joints."""
