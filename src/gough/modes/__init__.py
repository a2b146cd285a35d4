"""All the poses that six readings allow: tracked, counted, proven, ranked."""
