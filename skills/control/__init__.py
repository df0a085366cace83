"""The torque controller: a task-space QP, its tasks, limits and contacts."""
