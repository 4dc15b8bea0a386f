"""From what pages do with their handles to the handle that the input device hears."""
