"""What is asked: a workflow file or a user's own scene, checked."""
