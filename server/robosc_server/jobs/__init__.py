"""Jobs: tasks that go on without their caller."""
