"""Questions over many units, benches and months: history, yield, trends, golden units, sets that fit together,
and the model that is learned from a batch."""
