"""Two arms that grasp a box: refining controllers, their goal regions, and what runs them."""
