"""A hand that feels: touch, grasp residuals and what they make the fingers do, grasp quality."""
