"""`survey view`: a map in the browser, served to this machine alone (needs the extra `view`).

shown.py   a survey's file and a view of it: the link, what is known of a point
raster.py  a window of the map -> pixels
page.py    the page in the browser
looks.py   its pieces of HTML and models
server.py  who may see it
"""
