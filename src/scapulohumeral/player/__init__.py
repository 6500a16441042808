"""A 3-D view of shoulders for offline pages: scenes, and the page element that shows them."""
