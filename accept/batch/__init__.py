"""Units judged, one or many: from folders to stored, certified judgements, and the files that scripts read."""
