"""From what pages do with their handles to what the input device is told."""
