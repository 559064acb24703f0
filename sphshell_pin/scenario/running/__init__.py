"""Running scenarios: results folders, figures beside the expected ones, replays."""
