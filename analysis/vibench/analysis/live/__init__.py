"""What a running measurement shows, frame by frame: cheap, from the newest samples, in bounded memory."""
