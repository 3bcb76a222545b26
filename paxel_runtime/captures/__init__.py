"""What a session shows, sees and reads: its plan, the loop that runs it, the files that devices and people leave."""
