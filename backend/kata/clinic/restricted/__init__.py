"""Restricted records: care teams and break-glass accesses.

A *break-glass access* opens a restricted record to a user outside its care team, who gives a reason. The texts of the page call it an
emergency access. Names that are stored or public are older: the table ``broken_glass``, ``glass_id`` and ``glass_until`` in the API, and
codes of messages and of the audit trail.
"""
