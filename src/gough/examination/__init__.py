"""Examination of a machine's file and of its logs: facts, and likely mistakes with evidence."""
